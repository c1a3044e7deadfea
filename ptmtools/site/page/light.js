var g=`
vec3 linear(vec3 color){
vec3 curve=color*(color*(color*(color*-0.11677+0.52647)+0.5604)+0.0284)+0.00105;
return mix(curve,color/12.92,lessThanEqual(color,vec3(0.04045)));
}`,v=(s="0.8")=>`
vec3 developed(vec3 light){
float most=max(light.r,max(light.g,light.b));
if(most > ${s}){
float peak=1.0-0.04/(most-0.6);
light=mix(light*(peak/most),vec3(peak),1.0-1.0/(0.15*(most-peak)+1.0));
}
light=min(light,1.0);
vec3 root=sqrt(light),curve=0.29812*sqrt(root)+0.83374*root-0.05531*light-0.07691;
return mix(curve,12.92*light,lessThanEqual(light,vec3(0.0031308)));
}`,d=`
layout(location=3)in vec2 place2;
out vec2 spot;
uniform float white;
void main(){
spot=place2;`,x=({stops:s,tone:e})=>`
in vec2 spot;
uniform float white;
uniform sampler2D lightmap;
uniform vec3 code;
${g}
${v(e==="plain"?"1e30":void 0)}
vec3 display(vec3 texel){
if(white==0.0)return texel*color.rgb*painted;
vec3 share=code.r < 0.0?texture(lightmap,spot).rgb:code;
return developed(linear(texel)*color.rgb*painted*white*exp2(float(${s})*(share-1.0)));
}
void main`,w=`#version 300 es
precision highp float;
uniform mat3 turn;
uniform vec4 lens;
out vec3 way;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1)*4.0-1.0;
way=inverse(turn)*vec3(corner/lens.xy,-1.0);
gl_Position=vec4(corner,1.0,1.0);
}`,E=`#version 300 es
precision highp float;
in vec3 way;
uniform vec3 sky;
uniform vec3 ground;
out vec4 shown;
${v()}
void main(){
shown=vec4(developed(mix(ground,sky,smoothstep(-0.02,0.02,normalize(way).y))),1.0);
}`,m=class{exposure=1;#t=[];#o=0;#e=!0;#i=null;constructor(e){this.row=e}sources([e,o]){if(!o.includes("painted"))return[e,o];let i=o.replace(/sampled\.rgb ?\* ?color\.rgb ?\* ?painted/,"display(sampled.rgb)");return[e.replace(/void main\(\) ?{/,d).replace(/painted ?= ?paint\.rgb/,"painted = white > 0.0 ? pow(paint.rgb, vec3(4.0)) : paint.rgb"),i.replace("void main",x(this.row)).replace(/glow ?= ?0\.25/,"glow = white > 0.0 ? 1.0 : 0.7")]}illuminate(e){e.light=this,e.gl.deleteProgram(e.surface.program),e.surface=e.compile("surface")}adapt({cell:e,client:{known:o},index:{cells:i},memory:{fades:t},picture:u},n,c){let{exposure:r,row:{tone:l}}=this,p=e<0||l==="plain"?r:i[e].exposure??1;this.#e||=!(Math.hypot(...n.map((h,f)=>h-this.#t[f]))<1);let a=this.#e||!t?1:(r/p)**Math.exp((this.#o-c)/.2);this.exposure=Math.abs(Math.log(a))<.01?p:p*a,this.#e&&=!o[e],this.#o=c,this.#t=[...n],this.exposure!==r&&u.touch()}paint({gl:e,memory:o,means:i},t,{white:u,light:n},c){e.uniform1f(t.white,u*this.exposure);let r=n<0?null:o.of(n);if(e.uniform3fv(t.code,r?[-1,-1,-1]:i[n]??[1,1,1]),!r)return!1;e.activeTexture(e.TEXTURE1);let l=r.bind(!0,!0,c);return e.activeTexture(e.TEXTURE0),e.uniform1i(t.lightmap,1),l}surround(e,{turn:o,lens:i}){let{gl:t,surface:u}=e,{row:{tone:n,sky:c=[],ground:r=[]},exposure:l}=this;if(n==="plain")return;let{program:p,at:a}=this.#i??=e.compile("surroundings",[w,E]);t.useProgram(p),t.uniformMatrix3fv(a.turn,!1,o),t.uniform4fv(a.lens,i),t.uniform3fv(a.sky,c.map(h=>h*l)),t.uniform3fv(a.ground,r.map(h=>h*l)),t.bindVertexArray(null),t.depthFunc(t.LEQUAL),t.drawArrays(t.TRIANGLES,0,3),t.depthFunc(t.LESS),t.useProgram(u.program)}};function y({comparison:s,index:e,picture:{renderer:o}}){if(!e.light)return;let i=new m(e.light);i.illuminate(o),s&&i.illuminate(s.renderer)}export{m as Light,y as show};
