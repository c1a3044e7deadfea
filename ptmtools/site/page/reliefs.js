var W=()=>import("./statues.js");function U({texture:o,factor:e,blends:r,cutoff:t,twoSided:i,extras:n}){return[o,e,r,t,i,n].join()}function G(o){return o<=.0031308?12.92*o:1.055*o**(1/2.4)-.055}var T=(o="",e="")=>`#version 300 es
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
}`,B=`
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
}`,tt=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${B}
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
}`,Y=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,et=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${Y}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ot=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${Y}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,S={surface:[T(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),tt],item:[T(),et],placeholder:[T(),ot]};function C(o,e,r=S[e]){let t=o.createProgram(),i=[o.VERTEX_SHADER,o.FRAGMENT_SHADER];if(r.forEach((a,c)=>{let f=o.createShader(i[c]);o.shaderSource(f,a),o.compileShader(f),o.attachShader(t,f),o.deleteShader(f)}),o.linkProgram(t),!o.getProgramParameter(t,o.LINK_STATUS)&&!o.isContextLost())throw new Error(`${e}: ${o.getProgramInfoLog(t)}`);let n={},s=o.isContextLost()?0:o.getProgramParameter(t,o.ACTIVE_UNIFORMS);for(let a=0;a<s;a++){let c=o.getActiveUniform(t,a)?.name??"";n[c]=o.getUniformLocation(t,c)}return{program:t,at:n}}function q(o,{program:e,at:r},t){o.useProgram(e),o.uniform3fv(r.eye,t.eye),o.uniformMatrix3fv(r.turn,!1,t.turn),o.uniform4fv(r.lens,t.lens)}var R=class extends Error{constructor(e,r){super(r),this.code=e}};var rt=[.5,.7,.6].map(o=>o/Math.hypot(.5,.7,.6)),P=`
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${rt.join()}))) / 2.0;
  return ${.3} + ${1-.3} * along * along;
}`;function H(o,e,r,t=0,i=t){let n=0;for(let s=0;s<3;s++){let a=Math.max(e[t+s]-o[s],o[s]-r[i+s],0);n+=a*a}return Math.sqrt(n)}function j(o,e){let{T:r,K:t,gains:i,previews:{first:n}}=o;if(!X.has(i)){X.add(i);for(let s=0;s<r;s++)if(e[s].normals)for(let[a,c]of[[s,s+1],[r+n[s],r+n[s+1]]])for(let f=a*t;f<c*t;f++)i[f]*=.25}}var X=new WeakSet;var K=[2,3,4],F=33071,nt={normalWrapS:F,normalWrapT:F},st=.1,it=T(`
layout(location = 3) in vec2 second;
layout(location = 4) in vec3 up;
layout(location = 5) in vec4 right;
out vec2 at;
out mat3 axes;`,"at = second; axes = mat3(right.xyz, right.w * cross(up, right.xyz), up);"),at=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec2 at;
in mat3 axes;
uniform sampler2D relief;
uniform float cutoff;
out vec4 shown;
${B}
${P}
void main(){
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(axes*(texture(relief,at).rgb*2.0-1.0));
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,ct=P.replace("lit","lamplight"),ft=[T(`
layout(location = 3) in vec2 place2;
layout(location = 4) in vec2 place3;
out vec2 spot;
out vec2 at;`,"spot = place2; at = place3;"),S.surface[1].replace("out vec4 shown;",`out vec4 shown;
uniform mat3 turn;
uniform sampler2D relief;
uniform float scale;
in vec2 at;
${ct}`).replace(/shown ?= ?vec4/,`
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
  $&`)],N=class{#t=new Map;#a=new WeakMap;#c=new WeakMap;#o=new WeakSet;#r=!1;constructor(e,r,t){this.gl=e,this.report=t,this.walk=r,this.program=C(e,"relief",[it,at]),this.bumps=C(e,"bumps",ft),j(r.catalogue,r.index.textures)}delete(){for(let e of this.#t.keys())this.#i(e)}has(e){return this.walk.memory.held[e.relief]>0&&this.#n(e)}#n(e){let{relief:r,frames:t,positions:i}=e;if(r<0||this.#o.has(e))return!1;let n=i.length/3,s=t?.every((f,l)=>f.length===K[l]*n),a=k(e)?1:K.length,c=this.walk.index.textures[r];return s&&t?.length===a&&c&&(a===1||c.relief!==void 0)?!0:(this.#o.add(e),this.report(new R("PTM-V105",`The relief of ${e.name||"an object"} does not fit the index.`)),!1)}get lacks(){return!this.#r}get levels(){let{index:{textures:e},memory:{held:r}}=this.walk;return e.flatMap(({relief:t,normals:i},n)=>i||t!==void 0?[r[n]]:[])}advance(e,r,t){this.#f();let{gl:i,walk:{catalogue:{K:n,levels:s},client:a,present:c}}=this;if(!c)return;let f=i.drawingBufferWidth*i.drawingBufferHeight,l=!1,x=new Map;for(let{batches:u}of e)for(let{look:h,low:g,high:v}of u){let{relief:m,blends:y,texture:p}=h;if(y||!this.#n(h))continue;if(k(h)&&p>=0){let E=Math.log2(this.#e(h)/this.#e(h,p)),b=`${m} ${p}`,O=x.get(b)??new Float64Array(n);x.set(b,O);for(let M=1;M<=s[m];M++){let D=Math.max(1,s[p]-s[m]+M+E),_=Math.floor(D),[$,Q]=[_,_+1].map(V=>V<n?c[p*n+V]:0);O[M]=Math.max(O[M],$+(D-_)*(Q-$))}continue}let w=t/2/Math.max(st,H(r,g,v)),[A,I,L]=g.map((E,b)=>v[b]-E),z=Math.min(1,w*w*I*Math.max(A,L)/f),Z=Math.max(0,Math.floor(Math.log2(this.#e(h)/w)));for(let E=1,b=m*n+1;E<=Math.max(1,s[m]-Z);E++,b++)c[b]>=z||(c[b]=z,l=!0)}let d=new Map;for(let[u,h]of x){let g=parseInt(u)*n;h.forEach((v,m)=>d.set(g+m,(d.get(g+m)??0)+v))}for(let[u,h]of d)c[u]>=h||(c[u]=h,l=!0);l&&a.sees(c,a.hidden),this.#r=!0}#f(){if(!this.#t.size)return;let{renderer:e}=this.walk,r=new Set([...e?.cells.values()??[]].flatMap(({shapes:t})=>t));for(let t of this.#t.keys())r.has(t)||this.#i(t)}#e(e,r){let t=r===void 0?this.#a:this.#c,i=t.get(e);if(i)return i;let{positions:n,indices:s,relief:a,frames:c,uvs:f}=e,l=r===void 0?c?.[0]:f,{width:x,height:d}=this.walk.index.textures[r??a],u=0,h=0;for(let v=0;v<s.length;v+=3){let[m,y,p]=s.subarray(v,v+3);u+=J(n,3,m,y,p),h+=J(l,2,m,y,p)}let g=u*h>0?Math.sqrt(h*x*d/u):1;return t.set(e,g),g}draw(e,r,t,i){let{gl:n,walk:s}=this;for(let f of[this.program,this.bumps])q(n,f,e),n.uniform1i(f.at.relief,2);let a=!1,c=new Set;for(let{buffers:f,batch:l}of r){if(c.has(l.look))continue;c.add(l.look);let{relief:x,extras:d}=l.look,u=k(l.look),{normalScale:h=1,normalWrapS:g,normalWrapT:v}=u?JSON.parse(d):nt,m=g===F,y=v===F,p=u?this.bumps:this.program;n.useProgram(p.program),n.uniform1f(p.at.scale,h),n.activeTexture(n.TEXTURE2),a=s.memory.of(x)?.bind(m,y,i)||a,n.activeTexture(n.TEXTURE0),a=t(p.at,l)||a;let w=U(l.look);for(let A of f.shapes){if(U(A)!==w)continue;let{array:I,count:L}=this.#l(A);n.bindVertexArray(I),n.drawElements(n.TRIANGLES,L,n.UNSIGNED_INT,0)}}return a}#l(e){let r=this.#t.get(e);if(r)return r;let{gl:t}=this,{positions:i,uvs:n,colors:s,indices:a,frames:c,spots:f}=e,l=t.createVertexArray(),x=a.length;t.bindVertexArray(l);let d=[],[u,h,g=null]=c,v=s&&Float32Array.from(s,p=>G(p/65535)),m=[[0,i,3],[1,n,2],[2,v,4]];k(e)?m.push([3,f,2],[4,u,2]):m.push([3,u,2],[4,h,3],[5,g,4]);for(let[p,w,A]of m)w&&(d.push(this.#s(t.ARRAY_BUFFER,w)),t.enableVertexAttribArray(p),t.vertexAttribPointer(p,A,t.FLOAT,!1,0,0));t.vertexAttrib4f(2,1,1,1,1),d.push(this.#s(t.ELEMENT_ARRAY_BUFFER,Uint32Array.from(a))),t.bindVertexArray(null);let y={array:l,buffers:d,count:x};return this.#t.set(e,y),y}#s(e,r){let{gl:t}=this,i=t.createBuffer();return t.bindBuffer(e,i),t.bufferData(e,r,t.STATIC_DRAW),i}#i(e){let r=this.#t.get(e);if(r){this.gl.deleteVertexArray(r.array);for(let t of r.buffers)this.gl.deleteBuffer(t);this.#t.delete(e)}}},k=({extras:o})=>o.includes("normalCoords");function J(o,e,r,t,i){let n=d=>[0,1,2].map(u=>u<e?o[e*d+u]-o[e*r+u]:0),[s,a,c]=n(t),[f,l,x]=n(i);return Math.hypot(a*x-c*l,c*f-s*x,s*l-a*f)}async function Nt(o,e){let{index:{octrees:r},gl:t}=o;r&&(await W()).show(o,e);let{renderer:i}=o,n=new N(t,o,e);if(!i)return;let{statues:s}=i;i.statues=s?lt(s,n):n}function lt(o,e){return{delete(){o.delete(),e.delete()},has:r=>o.has(r)||e.has(r),get lacks(){return o.lacks||e.lacks},get levels(){return o.levels},get bytes(){return o.bytes},advance(r,t,i,n){o.advance(r,t,i,n),e.advance(r,t,i)},draw(r,t,i,n){let s=({batch:c})=>o.has(c.look),a=o.draw(r,t.filter(s),i,n);return e.draw(r,t.filter(c=>!s(c)),i,n)||a}}}export{Nt as show};
