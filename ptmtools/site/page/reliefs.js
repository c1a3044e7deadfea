var z=()=>import("./statues.js");function k({texture:o,clampU:t,clampV:r,factor:e,blends:c,cutoff:n,twoSided:s,octree:i,light:a,relief:f,bump:l}){return[o,t,r,e,c,n,s,i,a,f,l].join()}function P(o){return o<=.0031308?12.92*o:1.055*o**(1/2.4)-.055}var E=(o="",t="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${o}
void main(){
${t}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,F=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,I=(o="",t="")=>`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
uniform float glow;
out vec4 shown;
${F}${o}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
${t}
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,D=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,q=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${D}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,H=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${D}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,V={surface:[E(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),I()],item:[E(),q],placeholder:[E(),H]};function N(o,t,r=V[t]){let e=o.createProgram(),c=[o.VERTEX_SHADER,o.FRAGMENT_SHADER];if(r.forEach((i,a)=>{let f=o.createShader(c[a]);o.shaderSource(f,i),o.compileShader(f),o.attachShader(e,f),o.deleteShader(f)}),o.linkProgram(e),!o.getProgramParameter(e,o.LINK_STATUS)&&!o.isContextLost())throw new Error(`${t}: ${o.getProgramInfoLog(e)}`);let n={},s=o.isContextLost()?0:o.getProgramParameter(e,o.ACTIVE_UNIFORMS);for(let i=0;i<s;i++){let a=o.getActiveUniform(e,i)?.name??"";n[a]=o.getUniformLocation(e,a)}return{program:e,at:n}}function $(o,{program:t,at:r},e){o.useProgram(t),o.uniform3fv(r.eye,e.eye),o.uniformMatrix3fv(r.turn,!1,e.turn),o.uniform4fv(r.lens,e.lens)}var M=class extends Error{constructor(t,r){super(r),this.code=t}};var W=[.5,.7,.6].map(o=>o/Math.hypot(.5,.7,.6)),_=`
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${W.join()}))) / 2.0;
  return ${.3} + ${1-.3} * along * along;
}`;function C(o,t,r,e=0,c=e){let n=0;for(let s=0;s<3;s++){let i=Math.max(t[e+s]-o[s],o[s]-r[c+s],0);n+=i*i}return Math.sqrt(n)}var X=[2,3,4],j=.1,K=E(`
layout(location = 3) in vec2 second;
layout(location = 4) in vec3 up;
layout(location = 5) in vec4 right;
out vec2 at;
out mat3 axes;`,"at = second; axes = mat3(right.xyz, right.w * cross(up, right.xyz), up);"),Z=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec2 at;
in mat3 axes;
uniform sampler2D relief;
uniform float cutoff;
out vec4 shown;
${F}
${_}
void main(){
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(axes*(texture(relief,at).rgb*2.0-1.0));
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,J=_.replace("lit","lamplight"),Q=[E(`
layout(location = 3) in vec2 place2;
layout(location = 4) in vec2 place3;
out vec2 spot;
out vec2 at;`,"spot = place2; at = place3;"),I(`
uniform mat3 turn;
uniform sampler2D relief;
uniform float scale;
in vec2 at;
${J}`,`
  vec3 a = dFdx(seen), b = dFdy(seen);
  vec2 p = dFdx(at), q = dFdy(at);
  float side = sign(p.x * q.y - p.y * q.x);
  vec3 up = normalize(cross(a, b)), right = (a * q.y - b * p.y) * side, over = (a * q.x - b * p.x) * side;
  if (dot(right, right) > 0.0) {
    vec3 tilt = texture(relief, at).rgb * 2.0 - 1.0;
    right = normalize(right);
    vec3 across = cross(up, right);
    if (dot(across, over) < 0.0) across = -across;
    vec3 normal = scale * (right * tilt.x + across * tilt.y) + up * tilt.z;
    light *= lamplight(normalize(normal) * turn) / lamplight(up * turn);
  }`)],R=class{#t=new Map;#a=new WeakMap;#c=new WeakMap;#o=new WeakSet;#r=!1;constructor(t,r,e){this.gl=t,this.report=e,this.walk=r,this.program=N(t,"relief",[K,Z]),this.bumps=N(t,"bumps",Q)}delete(){for(let t of this.#t.keys())this.#i(t)}has(t){return this.walk.memory.held[t.relief]>0&&this.#n(t)}#n(t){let{relief:r,frames:e,positions:c,bump:n}=t;if(r<0||this.#o.has(t))return!1;let s=c.length/3,i=e?.every((f,l)=>f.length===X[l]*s),a=this.walk.index.textures[r];return i&&a&&(n||a.relief!==void 0)?!0:(this.#o.add(t),this.report(new M("PTM-V105",`The relief of ${t.name||"an object"} does not fit the index.`)),!1)}get lacks(){return!this.#r}get levels(){let{index:{textures:t},memory:{held:r}}=this.walk;return t.flatMap(({relief:e,normals:c},n)=>c||e!==void 0?[r[n]]:[])}advance(t,r,e){this.#f();let{gl:c,walk:{catalogue:{K:n,levels:s},client:i,present:a}}=this;if(!a)return;let f=c.drawingBufferWidth*c.drawingBufferHeight,l=!1;for(let{batches:v}of t)for(let{look:h,low:u,high:x}of v){let{relief:p,blends:d,bump:b,texture:m}=h;if(d||!this.#n(h))continue;if(b&&m>=0){let w=Math.log2(this.#e(h)/this.#e(h,m));for(let g=1;g<=s[p];g++){let L=Math.ceil(Math.max(1,s[m]-s[p]+g+w)),U=L<n?a[m*n+L]:0,B=p*n+g;a[B]>=U||(a[B]=U,l=!0)}continue}let y=e/2/Math.max(j,C(r,u,x)),[A,T,S]=u.map((w,g)=>x[g]-w),O=Math.min(1,y*y*T*Math.max(A,S)/f),Y=Math.max(0,Math.floor(Math.log2(this.#e(h)/y)));for(let w=1,g=p*n+1;w<=Math.max(1,s[p]-Y);w++,g++)a[g]>=O||(a[g]=O,l=!0)}l&&i.sees(a,i.hidden),this.#r=!0}#f(){if(!this.#t.size)return;let{renderer:t}=this.walk,r=new Set([...t?.cells.values()??[]].flatMap(({shapes:e})=>e));for(let e of this.#t.keys())r.has(e)||this.#i(e)}#e(t,r){let e=r===void 0?this.#a:this.#c,c=e.get(t);if(c)return c;let{positions:n,indices:s,relief:i,frames:a,uvs:f}=t,l=r===void 0?a?.[0]:f,{width:v,height:h}=this.walk.index.textures[r??i],u=0,x=0;for(let d=0;d<s.length;d+=3){let[b,m,y]=s.subarray(d,d+3);u+=G(n,3,b,m,y),x+=G(l,2,b,m,y)}let p=u*x>0?Math.sqrt(x*v*h/u):1;return e.set(t,p),p}draw(t,r,e,c){let{gl:n,walk:s}=this;for(let f of[this.program,this.bumps])$(n,f,t),n.uniform1i(f.at.relief,2);let i=!1,a=new Set;for(let{buffers:f,batch:l}of r){if(a.has(l.look))continue;a.add(l.look);let{relief:v,bump:h}=l.look,[u,x,p]=h??[1,!0,!0],d=h?this.bumps:this.program;n.useProgram(d.program),n.uniform1f(d.at.scale,u),n.activeTexture(n.TEXTURE2),i=s.memory.of(v)?.bind(x,p,c)||i,n.activeTexture(n.TEXTURE0),i=e(d.at,l)||i;let b=k(l.look);for(let m of f.shapes){if(k(m)!==b)continue;let{array:y,count:A}=this.#l(m);n.bindVertexArray(y),n.drawElements(n.TRIANGLES,A,n.UNSIGNED_INT,0)}}return i}#l(t){let r=this.#t.get(t);if(r)return r;let{gl:e}=this,{positions:c,uvs:n,colors:s,indices:i,frames:a,bump:f,spots:l}=t,v=e.createVertexArray(),h=i.length;e.bindVertexArray(v);let u=[],[x,p,d=null]=a,b=s&&Float32Array.from(s,A=>P(A/65535)),m=[[0,c,3],[1,n,2],[2,b,4]];f?m.push([3,l,2],[4,x,2]):m.push([3,x,2],[4,p,3],[5,d,4]);for(let[A,T,S]of m)T&&(u.push(this.#s(e.ARRAY_BUFFER,T)),e.enableVertexAttribArray(A),e.vertexAttribPointer(A,S,e.FLOAT,!1,0,0));e.vertexAttrib4f(2,1,1,1,1),u.push(this.#s(e.ELEMENT_ARRAY_BUFFER,Uint32Array.from(i))),e.bindVertexArray(null);let y={array:v,buffers:u,count:h};return this.#t.set(t,y),y}#s(t,r){let{gl:e}=this,c=e.createBuffer();return e.bindBuffer(t,c),e.bufferData(t,r,e.STATIC_DRAW),c}#i(t){let r=this.#t.get(t);if(r){this.gl.deleteVertexArray(r.array);for(let e of r.buffers)this.gl.deleteBuffer(e);this.#t.delete(t)}}};function G(o,t,r,e,c){let n=h=>[0,1,2].map(u=>u<t?o[t*h+u]-o[t*r+u]:0),[s,i,a]=n(e),[f,l,v]=n(c);return Math.hypot(i*v-a*l,a*f-s*v,s*l-i*f)}async function yt(o,t){let r=new R(o.gl,o,t);if(!o.index.octrees)return r;let{statuesOf:e}=await z();return tt(e(o,t),r)}function tt(o,t){return{delete(){o.delete(),t.delete()},has:r=>o.has(r)||t.has(r),get lacks(){return o.lacks||t.lacks},get levels(){return o.levels},get bytes(){return o.bytes},advance(r,e,c,n){o.advance(r,e,c,n),t.advance(r,e,c)},draw(r,e,c,n){let s=({batch:a})=>o.has(a.look),i=o.draw(r,e.filter(s),c);return t.draw(r,e.filter(a=>!s(a)),c,n)||i}}}export{yt as statuesOf};
