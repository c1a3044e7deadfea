var j=()=>import("./statues.js");function U({texture:o,factor:e,blends:r,cutoff:t,twoSided:a,extras:n}){return[o,e,r,t,a,n].join()}function G(o){return o<=.0031308?12.92*o:1.055*o**(1/2.4)-.055}var E=(o="",e="")=>`#version 300 es
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
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,C=`
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
}`,oe=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${C}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,q=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,re=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${q}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ne=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${q}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,M={surface:[E(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),oe],item:[E(),re],placeholder:[E(),ne]};function _(o,e,r=M[e]){let t=o.createProgram(),a=[o.VERTEX_SHADER,o.FRAGMENT_SHADER];if(r.forEach((i,l)=>{let c=o.createShader(a[l]);o.shaderSource(c,i),o.compileShader(c),o.attachShader(t,c),o.deleteShader(c)}),o.linkProgram(t),!o.getProgramParameter(t,o.LINK_STATUS)&&!o.isContextLost())throw new Error(`${e}: ${o.getProgramInfoLog(t)}`);let n={},s=o.isContextLost()?0:o.getProgramParameter(t,o.ACTIVE_UNIFORMS);for(let i=0;i<s;i++){let l=o.getActiveUniform(t,i)?.name??"";n[l]=o.getUniformLocation(t,l)}return{program:t,at:n}}function H(o,{program:e,at:r},t){o.useProgram(e),o.uniform3fv(r.eye,t.eye),o.uniformMatrix3fv(r.turn,!1,t.turn),o.uniform4fv(r.lens,t.lens)}var S=class extends Error{constructor(e,r){super(r),this.code=e}};var se=[.5,.7,.6].map(o=>o/Math.hypot(.5,.7,.6)),B=`
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${se.join()}))) / 2.0;
  return ${.3} + ${1-.3} * along * along;
}`;function Y(o,e,r,t=0,a=t){let n=0;for(let s=0;s<3;s++){let i=Math.max(e[t+s]-o[s],o[s]-r[a+s],0);n+=i*i}return Math.sqrt(n)}function K(o,e){let{T:r,K:t,gains:a,previews:{first:n}}=o;if(!X.has(a)){X.add(a);for(let s=0;s<r;s++)if(e[s].normals)for(let[i,l]of[[s,s+1],[r+n[s],r+n[s+1]]])for(let c=i*t;c<l*t;c++)a[c]*=.25}}var X=new WeakSet;var ae=(o,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[o]);var D=ae("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."});var Me=Promise.resolve();var J=(o,e)=>o.replace(/\{(\w+)\}/g,(r,t)=>e[t]);var Z=[2,3,4],L=33071,ie={normalWrapS:L,normalWrapT:L},le=.1,ce=E(`
layout(location = 3) in vec2 second;
layout(location = 4) in vec3 up;
layout(location = 5) in vec4 right;
out vec2 at;
out mat3 axes;`,"at = second; axes = mat3(right.xyz, right.w * cross(up, right.xyz), up);"),fe=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec2 at;
in mat3 axes;
uniform sampler2D relief;
uniform float cutoff;
out vec4 shown;
${C}
${B}
void main(){
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(axes*(texture(relief,at).rgb*2.0-1.0));
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,ue=B.replace("lit","lamplight"),he=[E(`
layout(location = 3) in vec2 place2;
layout(location = 4) in vec2 place3;
out vec2 spot;
out vec2 at;`,"spot = place2; at = place3;"),M.surface[1].replace("out vec4 shown;",`out vec4 shown;
uniform mat3 turn;
uniform sampler2D relief;
uniform float scale;
in vec2 at;
${ue}`).replace(/shown ?= ?vec4/,`
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
  }
  $&`)],F=class{#e=new Map;#i=new WeakMap;#l=new WeakMap;#o=new WeakSet;#r=!1;constructor(e,r,t){this.gl=e,this.report=t,this.walk=r,this.program=_(e,"relief",[ce,fe]),this.bumps=_(e,"bumps",he),K(r.catalogue,r.index.textures)}delete(){for(let e of this.#e.keys())this.#a(e)}has(e){return this.walk.memory.held[e.relief]>0&&this.#n(e)}#n(e){let{relief:r,frames:t,positions:a}=e;if(r<0||this.#o.has(e))return!1;let n=a.length/3,s=t?.every((c,f)=>c.length===Z[f]*n),i=R(e)?1:Z.length,l=this.walk.index.textures[r];return s&&t?.length===i&&l&&(i===1||l.relief!==void 0)?!0:(this.#o.add(e),this.report(new S("PTM-V105",J(D.relief,{name:e.name||D.object}))),!1)}get lacks(){return!this.#r}get levels(){let{index:{textures:e},memory:{held:r}}=this.walk;return e.flatMap(({relief:t,normals:a},n)=>a||t!==void 0?[r[n]]:[])}advance(e,r,t){this.#c();let{gl:a,walk:{catalogue:{K:n,levels:s},client:i,present:l}}=this;if(!l)return;let c=a.drawingBufferWidth*a.drawingBufferHeight,f=!1,w=new Map;for(let{batches:u}of e)for(let{look:h,low:v,high:g}of u){let{relief:d,blends:x,texture:m}=h;if(x||!this.#n(h))continue;if(R(h)&&m>=0){let A=Math.log2(this.#t(h)/this.#t(h,m)),b=`${d} ${m}`,I=w.get(b)??new Float64Array(n);w.set(b,I);for(let k=1;k<=s[d];k++){let V=Math.max(1,s[m]-s[d]+k+A),O=Math.floor(V),[W,te]=[O,O+1].map($=>$<n?l[m*n+$]:0);I[k]=Math.max(I[k],W+(V-O)*(te-W))}continue}let y=t/2/Math.max(le,Y(r,v,g)),[T,N,P]=v.map((A,b)=>g[b]-A),z=Math.min(1,y*y*N*Math.max(T,P)/c),ee=Math.max(0,Math.floor(Math.log2(this.#t(h)/y)));for(let A=1,b=d*n+1;A<=Math.max(1,s[d]-ee);A++,b++)l[b]>=z||(l[b]=z,f=!0)}let p=new Map;for(let[u,h]of w){let v=parseInt(u)*n;h.forEach((g,d)=>p.set(v+d,(p.get(v+d)??0)+g))}for(let[u,h]of p)l[u]>=h||(l[u]=h,f=!0);f&&i.sees(l,i.hidden),this.#r=!0}#c(){if(!this.#e.size)return;let{renderer:e}=this.walk,r=new Set([...e?.cells.values()??[]].flatMap(({shapes:t})=>t));for(let t of this.#e.keys())r.has(t)||this.#a(t)}#t(e,r){let t=r===void 0?this.#i:this.#l,a=t.get(e);if(a)return a;let{positions:n,indices:s,relief:i,frames:l,uvs:c}=e,f=r===void 0?l?.[0]:c,{width:w,height:p}=this.walk.index.textures[r??i],u=0,h=0;for(let g=0;g<s.length;g+=3){let[d,x,m]=s.subarray(g,g+3);u+=Q(n,3,d,x,m),h+=Q(f,2,d,x,m)}let v=u*h>0?Math.sqrt(h*w*p/u):1;return t.set(e,v),v}draw(e,r,t,a){let{gl:n,walk:s}=this;for(let c of[this.program,this.bumps])H(n,c,e),n.uniform1i(c.at.relief,2);let i=!1,l=new Set;for(let{buffers:c,batch:f}of r){if(l.has(f.look))continue;l.add(f.look);let{relief:w,extras:p}=f.look,u=R(f.look),{normalScale:h=1,normalWrapS:v,normalWrapT:g}=u?JSON.parse(p):ie,d=v===L,x=g===L,m=u?this.bumps:this.program;n.useProgram(m.program),n.uniform1f(m.at.scale,h),n.activeTexture(n.TEXTURE2),i=s.memory.of(w)?.bind(d,x,a)||i,n.activeTexture(n.TEXTURE0),i=t(m.at,f)||i;let y=U(f.look);for(let T of c.shapes){if(U(T)!==y)continue;let{array:N,count:P}=this.#f(T);n.bindVertexArray(N),n.drawElements(n.TRIANGLES,P,n.UNSIGNED_INT,0)}}return i}#f(e){let r=this.#e.get(e);if(r)return r;let{gl:t}=this,{positions:a,uvs:n,colors:s,indices:i,frames:l,spots:c}=e,f=t.createVertexArray(),w=i.length;t.bindVertexArray(f);let p=[],[u,h,v=null]=l,g=s&&Float32Array.from(s,m=>G(m/65535)),d=[[0,a,3],[1,n,2],[2,g,4]];R(e)?d.push([3,c,2],[4,u,2]):d.push([3,u,2],[4,h,3],[5,v,4]);for(let[m,y,T]of d)y&&(p.push(this.#s(t.ARRAY_BUFFER,y)),t.enableVertexAttribArray(m),t.vertexAttribPointer(m,T,t.FLOAT,!1,0,0));t.vertexAttrib4f(2,1,1,1,1),p.push(this.#s(t.ELEMENT_ARRAY_BUFFER,Uint32Array.from(i))),t.bindVertexArray(null);let x={array:f,buffers:p,count:w};return this.#e.set(e,x),x}#s(e,r){let{gl:t}=this,a=t.createBuffer();return t.bindBuffer(e,a),t.bufferData(e,r,t.STATIC_DRAW),a}#a(e){let r=this.#e.get(e);if(r){this.gl.deleteVertexArray(r.array);for(let t of r.buffers)this.gl.deleteBuffer(t);this.#e.delete(e)}}},R=({extras:o})=>o.includes("normalCoords");function Q(o,e,r,t,a){let n=p=>[0,1,2].map(u=>u<e?o[e*p+u]-o[e*r+u]:0),[s,i,l]=n(t),[c,f,w]=n(a);return Math.hypot(i*w-l*f,l*c-s*w,s*f-i*c)}async function ze(o,e){let{index:{octrees:r},gl:t}=o;r&&(await j()).show(o,e);let{renderer:a}=o,n=new F(t,o,e);if(!a)return;let{statues:s}=a;a.statues=s?de(s,n):n}function de(o,e){return{delete(){o.delete(),e.delete()},has:r=>o.has(r)||e.has(r),get lacks(){return o.lacks||e.lacks},get levels(){return o.levels},get bytes(){return o.bytes},advance(r,t,a,n){o.advance(r,t,a,n),e.advance(r,t,a)},draw(r,t,a,n){let s=({batch:l})=>o.has(l.look),i=o.draw(r,t.filter(s),a,n);return e.draw(r,t.filter(l=>!s(l)),a,n)||i}}}export{ze as show};
